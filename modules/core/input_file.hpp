#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace km {

/// A file that cannot be read. what() is one line, "FILE: why".
struct InputFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Files are read whole: more than this is no input of ours but a mistake, or an endless device.
inline constexpr std::uintmax_t kMaxInputFile_bytes = std::uintmax_t{8} << 30U;

/// Why there is no file to read at `file`: "no such file", "a folder, not a file", or what the
/// system says of a loop of symbolic links, a name too long, a folder without permission. Empty if
/// there is one; pipes count. Does not throw.
[[nodiscard]] std::string problem_of_file(const std::filesystem::path& file);

/// A regular file, a folder, or either is there. As std::filesystem's, but false where those throw.
[[nodiscard]] bool is_file(const std::filesystem::path& path) noexcept;
[[nodiscard]] bool is_folder(const std::filesystem::path& path) noexcept;
[[nodiscard]] bool is_there(const std::filesystem::path& path) noexcept;

/// Nothing is there, not even what cannot be read: a file that may be left out was left out.
[[nodiscard]] bool is_absent(const std::filesystem::path& path) noexcept;

/// The bytes of `file`, at most `max_bytes`. Throws InputFileError.
[[nodiscard]] std::string read_input_file(const std::filesystem::path& file,
                                          std::uintmax_t max_bytes = kMaxInputFile_bytes);

/// A file as it was read: kind and permissions are those of what the bytes come from, whatever has
/// its name before or afterwards.
struct InputFile {
  std::string bytes;
  std::filesystem::file_status status;
};
/// Likewise.
[[nodiscard]] InputFile open_input_file(const std::filesystem::path& file,
                                        std::uintmax_t max_bytes = kMaxInputFile_bytes);

}  // namespace km
