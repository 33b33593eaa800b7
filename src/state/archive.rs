//! What a run carries over, packed into bytes and unpacked again bit for bit.
//!
//! One function of each type lists its fields once, for both directions, so that none can be packed and
//! forgotten when it is unpacked. All numbers are little-endian; lists begin with their length.

use glam::DVec3;

/// Bytes that values are packed into, or unpacked from.
#[derive(Debug)]
pub struct Archive {
    bytes: Vec<u8>,
    /// Where the next value is unpacked from; `None` while values are packed.
    next: Option<usize>,
    /// Whether a value was not there, or none that its place takes.
    damaged: bool,
}

/// The bytes are not what was packed for this model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the checkpoint was made by another version of muslin or for another model, or is damaged")]
pub struct Damaged;

impl Archive {
    /// An archive that takes what passes.
    pub fn pack() -> Self {
        Self {
            bytes: Vec::new(),
            next: None,
            damaged: false,
        }
    }

    /// An archive that gives what was packed to those who pass, in the same order.
    pub fn unpack(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            next: Some(0),
            damaged: false,
        }
    }

    /// Whether values are unpacked.
    pub fn unpacks(&self) -> bool {
        self.next.is_some()
    }

    /// The packed bytes.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Checks that everything was unpacked and nothing was missing.
    ///
    /// # Errors
    ///
    /// When something was, or is left.
    pub fn finish(self) -> Result<(), Damaged> {
        match self.next {
            Some(next) if self.damaged || next != self.bytes.len() => Err(Damaged),
            _ => Ok(()),
        }
    }

    /// Notes that a value doesn't fit.
    pub fn damage(&mut self) {
        self.damaged = true;
    }

    /// Eight bytes either way.
    fn word(&mut self, word: u64) -> u64 {
        let Some(next) = self.next else {
            self.bytes.extend_from_slice(&word.to_le_bytes());
            return word;
        };
        match self.bytes[next..].first_chunk() {
            Some(bytes) => {
                self.next = Some(next + bytes.len());
                u64::from_le_bytes(*bytes)
            }
            None => {
                self.damaged = true;
                word
            }
        }
    }

    /// A number.
    pub fn real(&mut self, x: &mut f64) {
        *x = f64::from_bits(self.word(x.to_bits()));
    }

    /// A count.
    pub fn count(&mut self, n: &mut u64) {
        *n = self.word(*n);
    }

    /// An index or a length.
    pub fn index(&mut self, n: &mut usize) {
        match usize::try_from(self.word(*n as u64)) {
            Ok(word) => *n = word,
            Err(_) => self.damaged = true,
        }
    }

    /// A small index.
    pub fn small(&mut self, n: &mut u32) {
        match u32::try_from(self.word(u64::from(*n))) {
            Ok(word) => *n = word,
            Err(_) => self.damaged = true,
        }
    }

    /// Yes or no.
    pub fn flag(&mut self, flag: &mut bool) {
        *flag = self.word(u64::from(*flag)) != 0;
    }

    /// A vector.
    pub fn vector(&mut self, v: &mut DVec3) {
        self.real(&mut v.x);
        self.real(&mut v.y);
        self.real(&mut v.z);
    }

    /// A list that is as long on both sides, since the model says how long.
    pub fn each<T>(&mut self, list: &mut [T], mut one: impl FnMut(&mut Self, &mut T)) {
        let mut length = list.len();
        self.index(&mut length);
        if length == list.len() {
            list.iter_mut().for_each(|item| one(self, item));
        } else {
            self.damaged = true;
        }
    }

    /// A list of any length.
    pub fn list<T: Default>(&mut self, list: &mut Vec<T>, mut one: impl FnMut(&mut Self, &mut T)) {
        let mut length = list.len();
        self.index(&mut length);
        if let Some(next) = self.next {
            list.clear();
            // Each item has a byte at least: a length of nonsense must not ask for all memory.
            if self.damaged || length > self.bytes.len() - next {
                self.damaged = true;
                return;
            }
            list.resize_with(length, T::default);
        }
        list.iter_mut().for_each(|item| one(self, item));
    }

    /// Something that may be there or not.
    pub fn option<T: Default>(
        &mut self,
        option: &mut Option<T>,
        one: impl FnOnce(&mut Self, &mut T),
    ) {
        let mut there = option.is_some();
        self.flag(&mut there);
        if !there {
            *option = None;
        } else if !self.damaged {
            one(self, option.get_or_insert_default());
        }
    }

    /// Vectors, one a particle.
    pub fn vectors(&mut self, list: &mut [DVec3]) {
        self.each(list, Self::vector);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, Default, PartialEq)]
    struct Luggage {
        x: f64,
        steps: u64,
        flag: bool,
        places: Vec<DVec3>,
        some: Option<u32>,
        list: Vec<usize>,
    }

    impl Luggage {
        fn carry(&mut self, archive: &mut Archive) {
            archive.real(&mut self.x);
            archive.count(&mut self.steps);
            archive.flag(&mut self.flag);
            archive.vectors(&mut self.places);
            archive.option(&mut self.some, Archive::small);
            archive.list(&mut self.list, Archive::index);
        }
    }

    fn packed() -> (Luggage, Vec<u8>) {
        let mut luggage = Luggage {
            x: -0.0,
            steps: u64::MAX,
            flag: true,
            places: vec![DVec3::new(f64::MIN_POSITIVE / 4.0, f64::NEG_INFINITY, 0.1); 2],
            some: Some(7),
            list: vec![3, 1, 2],
        };
        let mut archive = Archive::pack();
        luggage.carry(&mut archive);
        (luggage, archive.into_bytes())
    }

    #[test]
    fn what_was_packed_comes_back_bit_for_bit() {
        let (luggage, bytes) = packed();
        let mut other = Luggage {
            places: vec![DVec3::ONE; 2],
            list: vec![9; 20],
            ..Luggage::default()
        };
        let mut archive = Archive::unpack(bytes);
        other.carry(&mut archive);
        assert_eq!(archive.finish(), Ok(()));
        assert_eq!(other, luggage);
        assert!(other.x.is_sign_negative());
    }

    #[test]
    fn damage_is_noticed_and_does_no_harm() {
        let (luggage, bytes) = packed();
        let fresh = || Luggage {
            places: vec![DVec3::ONE; 2],
            ..Luggage::default()
        };
        for length in 0..bytes.len() {
            let mut archive = Archive::unpack(bytes[..length].to_vec());
            fresh().carry(&mut archive);
            assert_eq!(archive.finish(), Err(Damaged), "cut at {length}");
        }
        let mut longer = Archive::unpack([bytes.clone(), vec![0]].concat());
        fresh().carry(&mut longer);
        assert_eq!(longer.finish(), Err(Damaged));
        let mut another = Archive::unpack(bytes);
        let mut fewer = Luggage {
            places: vec![DVec3::ONE],
            ..luggage
        };
        fewer.carry(&mut another);
        assert_eq!(
            another.finish(),
            Err(Damaged),
            "another number of particles"
        );
    }
}
