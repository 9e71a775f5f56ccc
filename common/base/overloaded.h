// Visiting a variant with one lambda an alternative: std::visit(Overloaded{[](A) {}, [](B) {}}, value).
#pragma once

namespace lightmill {

template <class... Handlers>
struct Overloaded : Handlers... {
  using Handlers::operator()...;
};
template <class... Handlers>
Overloaded(Handlers...) -> Overloaded<Handlers...>;

}  // namespace lightmill
