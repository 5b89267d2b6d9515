// The cases that take long: those of stability_test.cpp that are not quick.
#include "stability_test.cpp"
