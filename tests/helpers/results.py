"""The fields of a run's ``result.json``."""

RESULT_FIELDS = (
    *("schema", "command", "experiment", "backend", "seconds", "seeds", "settings", "files"),
    *("metrics", "activity", "link", "robot", "image_digest", "resources", "energy", "timing"),
    *("host_io", "energy_by_unit", "versions"),
)
