"""Pictures. Each module imports its plotting package only when it is called."""
