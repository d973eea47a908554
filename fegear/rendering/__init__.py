"""Fields of gears in contact, and pictures, films and pages of them."""
