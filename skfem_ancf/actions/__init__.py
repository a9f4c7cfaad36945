"""What acts in a scene: loads, supports, joints, springs, obstacles."""
