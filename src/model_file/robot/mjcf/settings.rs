//! Settings of the compiler of a file: units of angles, orders of Euler angles, sources of masses.

use crate::Result;
use crate::model_file::robot::xml::XmlElement;
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Where the masses of bodies come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MassSource {
    /// From `inertial` where there is one, otherwise from shapes.
    Automatic,
    Shapes,
    Inertial,
}

/// Settings of the elements `compiler` and `option`.
pub struct MjcfSettings {
    /// Radians of an angle of 1 in the file.
    angle: f64,
    /// Axes of Euler angles, and true if they are fixed.
    euler: [(usize, bool); 3],
    pub masses: MassSource,
    /// Groups of shapes that have masses.
    pub groups: [f64; 2],
    /// True if moments of inertia that are physically impossible are replaced by their mean.
    pub balances: bool,
    pub total_mass: Option<f64>,
    pub gravity: Vector3<f64>,
}

/// Attributes of `compiler` that are read, or that have no effect on the model.
const HARMLESS: [&str; 20] = [
    "angle",
    "eulerseq",
    "inertiafromgeom",
    "inertiagrouprange",
    "balanceinertia",
    "settotalmass",
    "autolimits",
    "meshdir",
    "texturedir",
    "assetdir",
    "coordinate",
    "convexhull",
    "discardvisual",
    "fusestatic",
    "usethread",
    "strippath",
    "exactmeshinertia",
    "alignfree",
    "saveinertial",
    "fitaabb",
];

impl MjcfSettings {
    /// Reads the settings of a file; adds a sentence for each that is left out.
    pub fn of(root: &XmlElement, left_out: &mut Vec<String>) -> Result<Self> {
        let mut all = Self {
            angle: std::f64::consts::PI / 180.0,
            euler: [(0, false), (1, false), (2, false)],
            masses: MassSource::Automatic,
            groups: [0.0, 5.0],
            balances: false,
            total_mass: None,
            gravity: Vector3::new(0.0, 0.0, -9.81),
        };
        for element in root.all("compiler") {
            all.read(element)?;
            let other = element.attributes.iter().filter(|(key, _)| !HARMLESS.contains(&&**key));
            left_out.extend(other.map(|(key, _)| format!("`{key}` of <compiler> was left out")));
        }
        for element in root.all("option") {
            if let Some(gravity) = element.triple("<option>", "gravity")? {
                all.gravity = gravity;
            }
            for flag in element.all("flag") {
                let disabled = flag.attributes.iter().filter(|(_, value)| value == "disable");
                for (key, _) in disabled {
                    match &**key {
                        "gravity" => all.gravity = Vector3::zeros(),
                        key => left_out.push(format!("`{key}` of <flag> was left out")),
                    }
                }
            }
            let forces = ["wind", "density", "viscosity", "magnetic"];
            let acts = |key: &&str| {
                element.attribute(key).is_some_and(|text| text.contains(|c: char| c.is_ascii_digit() && c != '0'))
            };
            left_out
                .extend(forces.iter().filter(|key| acts(key)).map(|key| format!("`{key}` of <option> was left out")));
        }
        Ok(all)
    }

    fn read(&mut self, element: &XmlElement) -> Result<()> {
        let what = "<compiler>";
        if element.attribute("coordinate") == Some("global") {
            let remedy = "convert the file by an old version of MuJoCo";
            return Err(element.bad(what, "its coordinates are global", remedy));
        }
        match element.attribute("angle") {
            Some("radian") => self.angle = 1.0,
            Some("degree") => self.angle = std::f64::consts::PI / 180.0,
            None => {}
            Some(_) => return Err(element.bad(what, "`angle` is neither degree nor radian", "use one of them")),
        }
        if let Some(order) = element.attribute("eulerseq") {
            let axis = |c: char| "xyz".find(c.to_ascii_lowercase()).map(|axis| (axis, c.is_ascii_uppercase()));
            let axes: Option<Vec<_>> = order.chars().map(axis).collect();
            let Some(Ok(axes)) = axes.map(|axes| axes.try_into()) else {
                return Err(element.bad(what, "`eulerseq` is no order of three axes", "give one such as \"xyz\""));
            };
            self.euler = axes;
        }
        match element.attribute("inertiafromgeom") {
            Some("true") => self.masses = MassSource::Shapes,
            Some("false") => self.masses = MassSource::Inertial,
            _ => {}
        }
        if let Some(text) = element.attribute("inertiagrouprange") {
            self.groups = element.exactly(what, "inertiagrouprange", text)?;
        }
        self.balances |= element.attribute("balanceinertia") == Some("true");
        self.total_mass = element.number(what, "settotalmass")?.filter(|mass| *mass > 0.0).or(self.total_mass);
        Ok(())
    }

    /// An angle of the file, or a value of a joint, in radians.
    pub fn radians(&self, angle: f64) -> f64 {
        angle * self.angle
    }

    /// The pose by `pos` and one of the ways to give an orientation.
    pub fn pose(&self, element: &XmlElement, what: &str) -> Result<Isometry3<f64>> {
        let at = element.triple(what, "pos")?.unwrap_or_else(Vector3::zeros);
        Ok(Isometry3::from_parts(Translation3::from(at), self.orientation(element, what)?))
    }

    fn orientation(&self, element: &XmlElement, what: &str) -> Result<UnitQuaternion<f64>> {
        let zero = |key: &str| element.bad(what, &format!("`{key}` has length zero"), "give a direction or a rotation");
        let direction = |key: &str, v: Vector3<f64>| Unit::try_new(v, 1e-12).ok_or_else(|| zero(key));
        if let Some(text) = element.attribute("quat") {
            let [w, i, j, k] = element.exactly(what, "quat", text)?;
            let quaternion = Quaternion::new(w, i, j, k);
            return UnitQuaternion::try_new(quaternion, 1e-12).ok_or_else(|| zero("quat"));
        }
        if let Some(text) = element.attribute("axisangle") {
            let [x, y, z, angle] = element.exactly(what, "axisangle", text)?;
            let axis = direction("axisangle", Vector3::new(x, y, z))?;
            return Ok(UnitQuaternion::from_axis_angle(&axis, self.radians(angle)));
        }
        if let Some(angles) = element.triple(what, "euler")? {
            let turns = self.euler.iter().zip(angles.iter()).map(|(&(axis, is_fixed), &angle)| {
                let axis = Unit::new_unchecked(Vector3::ith(axis, 1.0));
                (UnitQuaternion::from_axis_angle(&axis, self.radians(angle)), is_fixed)
            });
            return Ok(turns.fold(
                UnitQuaternion::identity(),
                |all, (turn, is_fixed)| {
                    if is_fixed { turn * all } else { all * turn }
                },
            ));
        }
        if let Some(text) = element.attribute("xyaxes") {
            let [a, b, c, d, e, f] = element.exactly(what, "xyaxes", text)?;
            let x = direction("xyaxes", Vector3::new(a, b, c))?.into_inner();
            let y = Vector3::new(d, e, f);
            let y = direction("xyaxes", y - x * x.dot(&y))?.into_inner();
            let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            return Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)));
        }
        if let Some(z) = element.triple(what, "zaxis")? {
            return Ok(along(direction("zaxis", z)?.into_inner()));
        }
        Ok(UnitQuaternion::identity())
    }
}

/// The smallest rotation that turns z to a unit vector.
pub fn along(z: Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), &z)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}
