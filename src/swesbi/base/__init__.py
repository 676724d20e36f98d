"""What every other package stands on: settings, arrays, progress of long work."""
