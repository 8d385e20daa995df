#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace km {

/// A JSON document whose keys keep their order. What makes or reads one includes
/// <nlohmann/json.hpp>, which takes two seconds to compile: in .cpp files only.
using Json = nlohmann::ordered_json;

/// The document, indented, and a line end. Doubles keep the digits that tell them apart; NaN and
/// infinities become null, bytes that are not UTF-8 the replacement character.
[[nodiscard]] std::string json_text(const Json& json);

/// Throws std::runtime_error naming the file if it is missing or no JSON.
[[nodiscard]] Json read_json(const std::filesystem::path& file);

/// The number at a JSON pointer like "/optimized/joint/position_m/rmse"; nullopt if there is none.
[[nodiscard]] std::optional<double> number_at(const Json& json, const char* pointer);

}  // namespace km
