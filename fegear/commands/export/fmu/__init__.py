"""A gear mesh as a functional mock-up unit (FMU) for simulations of machines."""

from fegear.commands.export.fmu.unit_file import FmuMesh, write_fmu

__all__ = ["FmuMesh", "write_fmu"]
