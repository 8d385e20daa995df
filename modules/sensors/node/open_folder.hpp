#pragma once

#include <filesystem>
#include <memory>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/euroc_reader.hpp"
#include "modules/sensors/image_folder.hpp"

namespace km {

/// The frames and the rig of `folder`, whose layout is not kEuroc. `camera_file`: see
/// open_folder().
[[nodiscard]] ImageFolder read_image_folder(const std::filesystem::path& folder,
                                            const std::filesystem::path& camera_file = {});

/// A reader of the recording in `folder`, in any FolderLayout. `camera_file` describes the camera
/// of a folder in TUM's layout; empty: tum_camera(). It has the keys `resolution`, `camera_model`,
/// `intrinsics`, `distortion_model` and `distortion_coefficients` of EuRoC's sensor.yaml, and the
/// keys `depth_scale` [m] (0.0002), `min_range_m` (0), `max_range_m` (8) and `baseline_m` (0.1) of
/// depth0/sensor.yaml. Only EuRoC's layout uses the correction of `options`, and has labels.
/// Throws DatasetError if the folder or a file cannot be used.
[[nodiscard]] std::unique_ptr<DatasetReader> open_folder(
    const std::filesystem::path& folder, const EurocOptions& options = {},
    const std::filesystem::path& camera_file = {});

}  // namespace km
