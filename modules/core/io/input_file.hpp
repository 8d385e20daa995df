#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace km {

/// A file that cannot be read. what() is one line, "FILE: why".
struct InputFileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Files are read whole. A larger input is a mistake, or an endless device.
inline constexpr std::uintmax_t kMaxInputFile_bytes = std::uintmax_t{8} << 30U;

/// The reason why there is no file to read at `file`: "no such file", "a folder, not a file", or
/// the system's message. The system reports, for example, a loop of symbolic links, a name too
/// long, or a folder without permission. Empty if there is a file or a pipe. Does not throw.
[[nodiscard]] std::string problem_of_file(const std::filesystem::path& file);

/// True if `path` is a regular file, a folder, or either of them. False if std::filesystem would
/// throw.
[[nodiscard]] bool is_file(const std::filesystem::path& path) noexcept;
[[nodiscard]] bool is_folder(const std::filesystem::path& path) noexcept;
[[nodiscard]] bool is_there(const std::filesystem::path& path) noexcept;

/// True if `path` does not exist: an optional file was omitted. False for an unreadable file.
[[nodiscard]] bool is_absent(const std::filesystem::path& path) noexcept;

/// Paths of the entries of a folder, ascending, up to an error; none if it cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> entries_of(const std::filesystem::path& folder);

/// The bytes of `file`, at most `max_bytes`. Throws InputFileError, also if nothing arrives in a
/// pipe for ten seconds.
[[nodiscard]] std::string read_input_file(const std::filesystem::path& file,
                                          std::uintmax_t max_bytes = kMaxInputFile_bytes);

/// A file with its bytes. Kind and permissions are those of the file that was read, even if another
/// file has taken its name.
struct InputFile {
  std::string bytes;
  std::filesystem::file_status status;
};
/// Reads `file` like read_input_file(), together with its status.
[[nodiscard]] InputFile open_input_file(const std::filesystem::path& file,
                                        std::uintmax_t max_bytes = kMaxInputFile_bytes);

}  // namespace km
