#include "sweep/map.hpp"
