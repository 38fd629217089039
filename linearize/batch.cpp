#include "linearize/batch.hpp"
