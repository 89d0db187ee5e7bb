"""The parts of docs/validation.md, one module a section; run by `python tools/validate.py`."""
