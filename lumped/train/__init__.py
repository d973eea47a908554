"""Model of a train: wheels, meshes, tables, excitations, contacts and friction."""
