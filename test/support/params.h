// Construction of parameters as the parser creates them, without a scene file.
#pragma once

#include "core/params/plugin.h"

namespace strobe::test {

/// A ParamSet whose parameters have the offsets 10, 20, … of an artificial source; the directive has offset
/// 0.
class Params {
  public:
    Params() {
        m_source->path = "test.scene";
        m_source->text = m_text;
        m_set = ParamSet(Location{m_source, 0});
    }
    Params& ints(const char* name, std::vector<int> values) {
        Param p = make(name, ParamType::Int);
        p.ints = std::move(values);
        return add(std::move(p));
    }
    Params& boolean(const char* name, bool value) {
        Param p = make(name, ParamType::Bool);
        p.ints = {value ? 1 : 0};
        return add(std::move(p));
    }
    Params& floats(const char* name, std::vector<float> values, ParamType type = ParamType::Float) {
        Param p = make(name, type);
        p.floats = std::move(values);
        return add(std::move(p));
    }
    Params& rgb(const char* name, float r, float g, float b) {
        return floats(name, {r, g, b}, ParamType::Rgb);
    }
    Params& point(const char* name, const V3f& v) {
        return floats(name, {v.x, v.y, v.z}, ParamType::Vector3);
    }
    Params& string(const char* name, const std::string& value) {
        Param p = make(name, ParamType::String);
        p.strings = {value};
        return add(std::move(p));
    }
    const ParamSet& get() const { return m_set; }
    operator const ParamSet&() const { return m_set; } // NOLINT: implicit

  private:
    Param make(const char* name, ParamType type) {
        Param p;
        p.name = name;
        p.type = type;
        p.where = Location{m_source, 10 * (m_set.all().size() + 1)};
        return p;
    }
    Params& add(Param p) {
        m_set.add(std::move(p));
        return *this;
    }
    static constexpr const char* m_text = "Directive                                                         "
                                          "                                  ";
    std::shared_ptr<Source> m_source = std::make_shared<Source>();
    ParamSet m_set;
};

/// Returns the offset of the location of the Error that `make` throws; -1 if it does not throw or there is no
/// location.
template <class F>
long errorOffset(F&& make) {
    try {
        make();
    } catch (const Error& e) {
        return e.location ? long(e.location.offset) : -1;
    }
    return -1;
}

} // namespace strobe::test
