"""Ball and roller bearings: Hertz contacts, kinematics, load on rolling elements."""
