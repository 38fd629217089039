#include "sweep/track.hpp"
