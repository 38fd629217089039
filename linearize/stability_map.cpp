#include "linearize/stability_map.hpp"
