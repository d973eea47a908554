"""Cases, their runs and metrics: models against finite elements."""
