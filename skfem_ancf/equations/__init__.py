"""The equations of a scene, and how they are solved."""
