"""The configuration of the study: typed, checked before any job starts, sliced by stage."""
