#pragma once

#include <filesystem>
#include <memory>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// True if open_bag() accepts `path`: a file, or a folder with .db3 or .mcap files.
[[nodiscard]] bool may_be_bag(const std::filesystem::path& path);

/// Opens a recording, whose kind is recognised by its first bytes: a bag of ROS 1 (.bag), an MCAP
/// file, or a database of rosbag2 (.db3). All .db3 or .mcap files in a folder of rosbag2 are read
/// as one recording. Throws InputFileError for anything else.
[[nodiscard]] std::unique_ptr<BagReader> open_bag(const std::filesystem::path& path);

}  // namespace km
