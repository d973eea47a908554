"""Pictures of statics and closed forms."""
