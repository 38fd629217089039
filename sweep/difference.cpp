#include "sweep/difference.hpp"
