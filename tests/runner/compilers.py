"""Prints how many compilers may run at once. Scripts give it to ninja."""
from process import compilers

print(compilers())
