"""Contact of spur gear teeth by plane finite elements."""
