#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace km {

/// Options of writing a file.
struct WriteOptions {
  unsigned mode = 0666;       ///< Permissions of the file, less the umask.
  bool through_links = true;  ///< False: an existing file or link is replaced and never written to.
  bool durable = false;       ///< Return only after the bytes are on the disk.
};

/// Writes `bytes` to `file`. The file appears under its name only when it is complete; until then
/// the former file stays. A device, a pipe or a link is written in place, but a link with the name
/// of the partial file is not followed. Throws std::system_error with one line with the file and
/// the reason, and leaves no partial file.
void write_file(const std::filesystem::path& file, std::string_view bytes,
                const WriteOptions& options = {});

/// Appends `waiting` to a file, which need not exist, and removes the written bytes from `waiting`.
/// If the disk is full, some bytes remain, with which the next call continues. Throws like
/// write_file() if bytes remain, or if a durable write may not have reached the disk.
void append_to_file(const std::filesystem::path& file, std::string& waiting,
                    const WriteOptions& options = {});

}  // namespace km
