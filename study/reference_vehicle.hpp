/// @file
/// The reference tiltrotor and the folder of the shipped data.
#pragma once

#include <filesystem>

#include "vehicles/tiltrotor/vehicle.hpp"

namespace tiltrim {

/// The folder of the shipped polars and published tables: the environment variable TILTRIM_DATA,
/// else data/ in the folder of the Python module, else the program's ../share/tiltrim/data, else
/// the source tree's data/ if it exists, else share/tiltrim/data of the configured installation.
std::filesystem::path data_directory();

/// The reference vehicle: default parameters and the default polar from data_directory(). Throws
/// std::runtime_error if the polar is missing.
Vehicle reference_vehicle();

}  // namespace tiltrim
