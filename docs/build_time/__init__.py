"""What happens to the pages when they are built."""
