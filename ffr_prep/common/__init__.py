"""What both packages share: errors, units, progress."""
