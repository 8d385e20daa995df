#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace km {

/// Semantic class of a surface, as stored in label images. 0 means unknown with any name.
using LabelId = std::uint8_t;

/// One semantic class with its colour in pictures.
struct LabelClass {
  using Color = std::array<std::uint8_t, 3>;  ///< red, green, blue

  LabelId id = 0;
  std::string name;
  Color color = {0, 0, 0};
};

/// The classes of a recording or a map, one per id. Several colours may belong to one class,
/// because Kimera-Semantics' tables list objects (a chair, a table) under their label (furniture).
/// The first entry of an id gives the class its name and its colour. id_of() recognises the colours
/// of the other entries.
class LabelPalette {
 public:
  LabelPalette() = default;

  /// Throws std::invalid_argument for a colour with two ids. Throws it also for a name that a table
  /// could not contain: empty, with surrounding blanks, or with a comma, `#` or line end in it.
  explicit LabelPalette(const std::vector<LabelClass>& entries);

  /// Ascending by id.
  [[nodiscard]] const std::vector<LabelClass>& classes() const { return classes_; }

  /// nullptr if no class has this id.
  [[nodiscard]] const LabelClass* find(LabelId id) const;

  /// The class with this colour, as its first or a further one; nullopt if there is none.
  [[nodiscard]] std::optional<LabelId> id_of(const LabelClass::Color& color) const;

  /// The entries of all colours, ascending by id, those of an id in their order.
  [[nodiscard]] const std::vector<LabelClass>& entries() const { return entries_; }

 private:
  std::vector<LabelClass> entries_;
  std::vector<LabelClass> classes_;  // the first entry of each id
  std::map<LabelClass::Color, LabelId> id_by_color_;
};

/// Parses `name,red,green,blue,alpha,id` with a header row (Kimera-Semantics' format). Alpha is
/// checked and dropped, `#` starts a comment. The first of several names with one colour and id is
/// kept. Throws std::invalid_argument with `source`, line and value.
[[nodiscard]] LabelPalette parse_label_palette(std::string_view csv, std::string_view source);

/// The palette in that format; parse_label_palette() reads it back unchanged.
[[nodiscard]] std::string to_csv(const LabelPalette& palette);

}  // namespace km
