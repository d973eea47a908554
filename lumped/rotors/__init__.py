"""Spinning shafts with disks and gears on bearings: whirling modes over the speed."""
