"""A drive's electronic data sheet (EDS or DCF, CiA 306): what it has, who it is, and what it shall be given."""
