#include "sweep/log.hpp"
