"""Images, networks, referees and problems that tests of several folders share."""
