"""Contact of teeth at rest over the mesh cycle: tables, stiffness, errors."""
