// The fixed parts of a report's page: its style, its script, and pictures as data URIs. Other reports may use them.
#pragma once

#include <string>
#include <string_view>

namespace lightmill::lab {

/// "data:image/png;base64,…".
std::string png_data_uri(std::string_view png);

/// Rules for the page, light and dark, with those of charts.
std::string page_css();

/// Pictures of one section are enlarged together around the point that is clicked; a box shows the differences.
std::string page_script();

}  // namespace lightmill::lab
