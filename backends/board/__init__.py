"""A board behind a link: frames, both ends of a session, faults and records; see docs/link.md."""
