"""What a train is: wheels, meshes, tables, excitations, contacts and friction."""
