#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace km {

/// How a file is written.
struct WriteOptions {
  unsigned mode = 0666;       ///< Permissions of the file, less the umask.
  bool through_links = true;  ///< Else whatever is there is replaced, never written to.
  bool durable = false;       ///< Returns once the bytes are on the disk.
};

/// Writes `bytes` to `file`, which appears under its name only when it is whole: until then what
/// was there before stays. What is no plain file (a device, a pipe, a link) is written in place,
/// but a link that has the name of a partial file is not followed. Throws std::system_error with
/// one line that names the file and why, and leaves nothing behind.
void write_file(const std::filesystem::path& file, std::string_view bytes,
                const WriteOptions& options = {});

/// Appends `waiting` to a file that need not exist, and takes what is written out of it. Throws
/// like write_file() where something is left, the disk being full, which the next call goes on
/// with; or where what is written may not be on the disk, as is asked for.
void append_to_file(const std::filesystem::path& file, std::string& waiting,
                    const WriteOptions& options = {});

}  // namespace km
