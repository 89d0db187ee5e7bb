"""A scene for Foxglove and Lichtblick: an MCAP file with Foxglove's own schemas, everything in the frame `map`."""
