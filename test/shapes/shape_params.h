// Construction of shape parameters without a scene file, and a check of located errors.
#pragma once

#include "core/interfaces/shape.h"
#include "core/params/plugin.h"
#include "core/util/diagnostics.h"

#include <gtest/gtest.h>

namespace strobe {

/// A ParamSet whose parameters have the offsets 10, 20, … of an artificial source; the directive has offset
/// 0.
class ShapeParams {
  public:
    ShapeParams() {
        m_source->path = "test.scene";
        m_source->text = "Shape";
        m_set = ParamSet(Location{m_source, 0});
    }
    ShapeParams& ints(const std::string& name, std::vector<int> values) {
        Param p = make(name, ParamType::Int);
        p.ints = std::move(values);
        return add(std::move(p));
    }
    ShapeParams& floats(const std::string& name, std::vector<float> values,
                        ParamType type = ParamType::Float) {
        Param p = make(name, type);
        p.floats = std::move(values);
        return add(std::move(p));
    }
    ShapeParams& points(const std::string& name, std::vector<float> values) {
        return floats(name, std::move(values), ParamType::Vector3);
    }
    ShapeParams& strings(const std::string& name, std::vector<std::string> values) {
        Param p = make(name, ParamType::String);
        p.strings = std::move(values);
        return add(std::move(p));
    }
    const ParamSet& set() const { return m_set; }
    /// Returns the offset of the parameter `name`; 0 (the directive) for the empty name.
    size_t offsetOf(const std::string& name) const {
        for (const Param& p : m_set.all()) {
            if (p.name == name)
                return p.where.offset;
        }
        return 0;
    }

  private:
    Param make(const std::string& name, ParamType type) {
        return {name, type, Location{m_source, 10 * (m_set.all().size() + 1)}, {}, {}, {}};
    }
    ShapeParams& add(Param p) {
        m_set.add(std::move(p));
        return *this;
    }
    std::shared_ptr<Source> m_source = std::make_shared<Source>();
    ParamSet m_set;
};

/// Creates the shape.
inline Shape makeShape(const Plugin<Shape>& plugin, const ShapeParams& params,
                       std::vector<float> keyTimes = {0, 1}, Diagnostics* diagnostics = nullptr) {
    Diagnostics quiet;
    BuildContext context{diagnostics ? *diagnostics : quiet};
    context.keyTimes = std::move(keyTimes);
    return plugin.create(params.set(), context);
}

/// Expects an Error at the parameter `name` (empty: at the directive) whose message contains `message`.
inline void expectShapeError(const Plugin<Shape>& plugin, const ShapeParams& params, const std::string& name,
                             const std::string& message) {
    try {
        makeShape(plugin, params);
        ADD_FAILURE() << "no error; expected: " << message;
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(message), std::string::npos)
            << "message: " << error.what() << "\nexpected: " << message;
        EXPECT_TRUE(error.location) << error.what();
        EXPECT_EQ(error.location.offset, params.offsetOf(name)) << error.what();
    }
}

} // namespace strobe
