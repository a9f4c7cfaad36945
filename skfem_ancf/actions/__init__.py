"""Items of a scene: loads, supports, joints, springs, obstacles."""
