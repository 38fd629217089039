#include "linearize/lanes.hpp"
