#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace km {

/// "robot0/optimized" for ".../robot0/optimized.tum".
inline std::string short_name(const std::filesystem::path& file) {
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path().filename();
  return (folder / file.stem()).string();
}

/// Throws std::runtime_error naming the file if it cannot be written.
inline void write_file(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace km
