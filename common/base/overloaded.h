// A visitor of variants with a lambda for each alternative, or for several. A variant alternative without a matching
// lambda is a compile error.
//
//   std::visit(Overloaded{[](const A&) {}, [](const OneOf<B, C> auto&) {}}, value);
#pragma once

#include <concepts>

namespace lightmill {

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

template <class Type, class... Types>
concept OneOf = (std::same_as<Type, Types> || ...);

}  // namespace lightmill
