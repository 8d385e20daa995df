#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace km {

/// The files in an MCAP file, by name; the last of several with one name. A truncated file yields
/// the files before the cut. Throws InputFileError if the file is no MCAP file, or if an attachment
/// is damaged.
[[nodiscard]] std::map<std::string, std::string> read_mcap_attachments(
    const std::filesystem::path& file);

}  // namespace km
