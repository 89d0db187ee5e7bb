"""The parts of a study's report: what is shown, in which words, tables and pages."""
