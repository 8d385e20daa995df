#pragma once

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "modules/core/io/json.hpp"
#include "modules/core/io/write_file.hpp"

namespace km {

/// Writes `file` with `writer(std::ostream&)`; does nothing if the name is empty. The file appears
/// complete or not at all, see write_file(). Throws std::runtime_error that names the file and the
/// reason.
inline void write_output(const std::filesystem::path& file, const auto& writer) {
  if (file.empty()) return;
  std::ostringstream out;
  writer(out);
  write_file(file, out.view());
}

/// Writes json_text() to `file` with write_output().
inline void write_json_output(const std::filesystem::path& file, const Json& json) {
  write_output(file, [&](std::ostream& out) { out << json_text(json); });
}

/// Makes the folder if it is absent. Throws std::runtime_error that names the folder and the reason
/// if it cannot be written to. Call it before the work, so that the error comes early.
inline void make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw std::runtime_error(folder.string() + ": cannot be made: " + error.message() +
                             "; choose another folder");
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw std::runtime_error(folder.string() + ": cannot be written to: " +
                             std::generic_category().message(errno) + "; choose another folder");
}

/// Throws if there is no folder for `file`, or if `file` is a folder (empty: no file requested).
inline void check_output_folder(const std::filesystem::path& file) {
  if (file.empty()) return;
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(file.string() + ": cannot be written, there is no folder " +
                             folder.string());
  if (std::filesystem::is_directory(file))
    throw std::runtime_error(file.string() + ": cannot be written, it is a folder");
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw std::runtime_error(file.string() + ": cannot be written: " + folder.string() + ": " +
                             std::generic_category().message(errno));
}

}  // namespace km
