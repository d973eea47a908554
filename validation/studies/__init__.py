"""Studies that compare models with evidence; listed by `fegear.studies`."""
