#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace km {

/// A JSON document whose keys keep their order. Code that creates or reads a document
/// includes <nlohmann/json.hpp>, which takes two seconds to compile, so include it only in .cpp
/// files.
using Json = nlohmann::ordered_json;

/// The document, indented, with a line end. Doubles have enough digits to distinguish them. NaN and
/// infinities become null. Bytes that are not UTF-8 become the replacement character.
[[nodiscard]] std::string json_text(const Json& json);

/// Throws std::runtime_error with the file name if the file is missing or not JSON.
[[nodiscard]] Json read_json(const std::filesystem::path& file);

}  // namespace km
