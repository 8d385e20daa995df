#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace km {

/// The attachments of an MCAP file by name; of several with one name, the last. A truncated file
/// yields its complete attachments. Throws InputFileError if the file is no MCAP file, or if an
/// attachment is damaged.
[[nodiscard]] std::map<std::string, std::string> read_mcap_attachments(
    const std::filesystem::path& file);

}  // namespace km
