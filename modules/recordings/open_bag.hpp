#pragma once

#include <filesystem>
#include <memory>

#include "modules/recordings/bag_reader.hpp"

namespace km {

/// True if `path` is what open_bag() looks into: a file, or a folder with .db3 or .mcap files.
[[nodiscard]] bool may_be_bag(const std::filesystem::path& path);

/// Opens a recording, which its first bytes tell from others: a bag of ROS 1 (.bag), an MCAP file,
/// a database of rosbag2 (.db3), or a folder of rosbag2, of which all .db3 or .mcap files are read
/// as one. Throws InputFileError if it is none.
[[nodiscard]] std::unique_ptr<BagReader> open_bag(const std::filesystem::path& path);

}  // namespace km
