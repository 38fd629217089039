#include "sweep/map_file.hpp"
