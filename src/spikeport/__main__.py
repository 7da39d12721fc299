"""``python -m spikeport``: the command line, where its script is not on the path."""

from spikeport.cli import main

if __name__ == "__main__":
    main()
