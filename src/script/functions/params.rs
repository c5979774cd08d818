//! Parameters: sliders in the studio, `--set name=value` on the command line.

use rhai::Engine;
use rhai::plugin::*;

use crate::recipe::{Param, Setting};
use crate::script::arguments::{Raw, number};
use crate::script::context::Context;
use crate::script::diagnostics::{pass, raise};

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

/// The declaration that the arguments of a `param(..)` call spell out, if they are plain.
pub(in crate::script) fn written_param(arguments: &[&str], line: usize) -> Option<Param> {
    let quoted = |text: &str| Some(text.strip_prefix('"')?.strip_suffix('"')?.to_string());
    let plain = |text: &str| match text {
        "true" | "false" => Some(Setting::Flag(text == "true")),
        _ if text.starts_with('"') => quoted(text).map(Setting::Text),
        _ => text
            .parse()
            .map(Setting::Integer)
            .or_else(|_| text.parse().map(Setting::Number))
            .ok(),
    };
    let bound = |index: usize| arguments.get(index).map(|text| text.parse::<f64>());
    let name = quoted(arguments.first()?)?;
    let default = plain(arguments.get(1)?)?;
    let range = match (bound(2), bound(3)) {
        (Some(Ok(least)), Some(Ok(greatest))) => Some((least, greatest)),
        (None, None) => None,
        _ => return None,
    };
    Some(Param {
        name,
        value: default.clone(),
        default,
        range,
        line,
    })
}

fn declare(
    call: &NativeCallContext,
    name: &str,
    default: &Dynamic,
    range: Option<(f64, f64)>,
) -> Raw<Dynamic> {
    let kind = default.type_name();
    let flag = default.as_bool().map(Setting::Flag);
    let setting = flag
        .or_else(|_| default.as_int().map(Setting::Integer))
        .or_else(|_| default.as_float().map(Setting::Number));
    let Ok(default) = setting.or_else(|_| default.clone().into_string().map(Setting::Text)) else {
        return raise(crate::diag::Diagnostic::error(format!(
            "a parameter is a number, a text, true or false, not {kind}"
        )));
    };
    let line = call.call_position().line().unwrap_or(1);
    let param = Param {
        name: name.to_string(),
        value: default.clone(),
        default,
        range,
        line,
    };
    Ok(match pass(Context::of(call)?.declare(param))? {
        Setting::Flag(value) => value.into(),
        Setting::Integer(value) => value.into(),
        Setting::Number(value) => value.into(),
        Setting::Text(value) => value.into(),
    })
}

#[export_module]
mod functions {
    /// Declares a parameter and gives its value: the default, or what `--set name=value` says.
    ///
    /// `param(name, default)`, `param(name, default, min, max)`
    ///
    /// Its kind is that of the default: a whole number, a number, a text, `true` or `false`. Values outside
    /// of min to max are refused.
    ///
    /// ```rhai
    /// let times = param("times", 2, 1, 6);
    /// check(times == 2, "the default");
    /// ```
    #[rhai_fn(name = "param", return_raw)]
    pub fn param(call: NativeCallContext, name: &str, default: Dynamic) -> Raw<Dynamic> {
        declare(&call, name, &default, None)
    }

    #[rhai_fn(name = "param", return_raw)]
    pub fn ranged(
        call: NativeCallContext,
        name: &str,
        default: Dynamic,
        min: Dynamic,
        max: Dynamic,
    ) -> Raw<Dynamic> {
        let range = (number(&min, "min")?, number(&max, "max")?);
        declare(&call, name, &default, Some(range))
    }
}
