// Vertex colours of an OBJ file.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

class ObjColors {
 public:
  /// Takes what follows the position of this vertex: a weight, or a colour, or a colour and its alpha. Other rests do
  /// not count.
  void read(std::size_t vertex, std::string_view rest);
  /// The linear colours of the first vertices (ObjFile::colors). Takes them out, and adds what was left out to
  /// `notices`.
  std::vector<std::array<float, 3>> take_linear(std::string_view file_name, std::vector<std::string>& notices);

 private:
  std::vector<std::array<float, 3>> colors_;  ///< as written
  bool has_alpha_ = false;                    ///< vertices have an alpha below 1
};

}  // namespace lightmill
