#pragma once

#include <span>
#include <string>

#include "modules/core/json_writer.hpp"
#include "modules/evaluation/images/image_figure.hpp"

namespace km {

/// Rows that differ by more than this share of the reference are marked.
inline constexpr double kMarkedDifference = 0.25;

/// A table for people: one row per figure under the headings of its section; "-" for what is not to
/// be had.
[[nodiscard]] std::string to_table(std::span<const ImageFigure> figures);

/// The same for two sequences side by side with the ratio other / reference; rows that differ by
/// more than kMarkedDifference of the reference end with `<--`, counts of frames excepted. Figures
/// that only one of the two has are left out. The last line counts rows compared and marked, in
/// all and of those at like flow (one bin of the median flow).
[[nodiscard]] std::string to_comparison(std::span<const ImageFigure> reference,
                                        std::span<const ImageFigure> other,
                                        const std::string& reference_name,
                                        const std::string& other_name);

/// One JSON object: {section: {name: value, ...}, ...}; null for what is not to be had.
void write_json(JsonWriter& json, std::span<const ImageFigure> figures);

/// The comparison as one JSON object: {"rows": [{"section", "name", "reference", "other", "ratio",
/// "differs"}, ...], "compared", "differing"}; "differs" is null for rows that are not judged:
/// amounts, and those without a ratio.
void write_comparison(JsonWriter& json, std::span<const ImageFigure> reference,
                      std::span<const ImageFigure> other);

}  // namespace km
