#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace km {

/// The files in an MCAP file, by name; of equal names the last. Of a file that is cut those before
/// the cut. Throws InputFileError if it is no MCAP file, or an attachment is damaged.
[[nodiscard]] std::map<std::string, std::string> read_mcap_attachments(
    const std::filesystem::path& file);

}  // namespace km
