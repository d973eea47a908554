"""What studies of a gear set's train share: gears, load, model, speeds and texts."""
