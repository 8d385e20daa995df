#pragma once

#include <filesystem>
#include <string>

namespace km {

/// The bytes of `file`. Throws DatasetError if it does not exist or cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);

/// "FILE line N", the start of every message about a row.
[[nodiscard]] std::string at_line(const std::filesystem::path& file, int line);

}  // namespace km
