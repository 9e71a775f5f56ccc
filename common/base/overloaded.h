// A visitor of variants with one lambda per alternative: std::visit(Overloaded{[](A) {}, [](B) {}}, value).
#pragma once

namespace lightmill {

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

}  // namespace lightmill
