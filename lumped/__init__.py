"""Lumped gear models: tables of mesh stiffness in, motion out."""

from lumped.table import MeshTable, read_table, write_table

__all__ = ["MeshTable", "read_table", "write_table"]
