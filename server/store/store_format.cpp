#include "server/store/store_format.h"

namespace lightmill {

Status check_store_format(std::string_view place, std::int64_t found, std::int64_t known, std::string_view elsewhere) {
  if (found == known) {
    return ok_status();
  }
  if (found < 1) {
    return failed_precondition(
        "{} has store format {}, which no lightmill-server writes: restore a backup, or choose {}", place, found,
        elsewhere);
  }
  const std::string_view age = found > known ? "newer" : "older";
  return failed_precondition(
      "{} has store format {}, {} than format {} of this lightmill-server: use the {} lightmill-server that wrote it, "
      "or choose {}",
      place, found, age, known, age, elsewhere);
}

}  // namespace lightmill
