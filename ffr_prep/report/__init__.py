"""What a body is: in words, numbers and pictures."""
