"""A diagnosis as plain data: the document of CONTRACT.md, and the numbers behind its figures."""
