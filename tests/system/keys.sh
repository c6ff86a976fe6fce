#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What `backwash keys` makes, read by the openssl program: chains, ends, signatures, revocations; who may write what; modes.
# No key is replaced unasked, and what is no name, time or topic is refused before anything is made.
#   keys.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
refused() { # refused CODE TEXT ARGUMENT …
  local wanted=$1 text=$2 code=0
  shift 2
  "$backwash" keys "$@" >/dev/null 2>stderr || code=$?
  [[ $code == "$wanted" ]] && grep -qF -- "$text" stderr || die "keys $*: $code $(<stderr)"
  [[ $(wc -l <stderr) == 1 ]] || die "keys $* says more than a line"
}
umask 000
"$backwash" keys init net >said
grep -q '^net: an authority until 20[0-9-]*T[0-9:]*Z; keep net/authority away' said || die "init said $(<said)"
"$backwash" keys add net drone --role vehicle --namespace fleet/one >/dev/null
"$backwash" keys add net eyes --role vio --topic rt/vins/odometry --topic rt/tf --until 2030-06-01 >/dev/null
"$backwash" keys add net pilot --role station >/dev/null
"$backwash" keys add net guest --role observer >/dev/null
for who in drone eyes pilot guest; do
  openssl verify -CAfile net/$who/identity_ca.cert.pem -CRLfile net/$who/crl.pem -crl_check net/$who/cert.pem >/dev/null 2>verify || die "$who: $(<verify)"
  for file in governance permissions; do
    openssl smime -verify -text -CAfile net/$who/permissions_ca.cert.pem -in net/$who/$file.p7s >$who.$file 2>verify || die "$who: $(<verify)"
  done
  [[ $(openssl pkey -in net/$who/key.pem -pubout) == $(openssl x509 -in net/$who/cert.pem -noout -pubkey) ]] || die "$who: another key"
  subject=$(openssl x509 -in net/$who/cert.pem -noout -subject -nameopt RFC2253)
  grep -qF "<subject_name>${subject#subject=}</subject_name>" $who.permissions || die "$who: $subject is not who the permissions are for"
done
[[ $(openssl x509 -in net/eyes/cert.pem -noout -enddate) == "notAfter=Jun  1 00:00:00 2030 GMT" ]] || die "--until was not kept"
may() { sed -n '/<publish>/,/<\/publish>/p' "$1.permissions" | grep -o '<topic>[^<]*' | sed 's/<topic>//' | sort | xargs; }
# topics WAY NAMESPACE TOPIC …: those of docs/interfaces.md that go there, but for the station's, and the others
topics() {
  { "$here/../support/topics.py" "$here/../.." | awk -v way="$1" -v at="rt/$2/" '$3 == way && $1 != "command" {print at $1}'
    printf '%s\n' "${@:3}"; } | sort | xargs
}
[[ $(may drone) == "$(topics out fleet/one rt/diagnostics rt/tf)" ]] || die "drone may write $(may drone)"
[[ $(may eyes) == "$(topics in backwash rt/vins/odometry rt/tf)" ]] || die "eyes may write $(may eyes)"
[[ $(may pilot) == "rt/backwash/command rt/backwash/map_part" && -z $(may guest) ]] || die "pilot may write $(may pilot), guest $(may guest)"
[[ $(find net -type f -name key.pem -not -perm 0600 -o -type d -not -perm 0700) == "" ]] || die "others may read what is secret: $(ls -lR net)"
[[ $(find net -name key.pem | wc -l) == 5 ]] || die "not five keys"

# Nothing is replaced unasked; what is replaced is replaced whole.
find net -type f -exec sha256sum {} + | sort >before
refused 73 'net/authority/key.pem:1: exists already' init net
refused 73 'net/pilot/key.pem:1: exists already' add net pilot --role station
refused 64 "'../pilot' is no name" add net ../pilot --role station
refused 64 "'authority' is no name" add net authority --role station
refused 64 "'a<b' is no name" add net 'a<b' --role station
refused 64 '--until 2020-01-01T00:00:00Z has passed' add net late --role station --until 2020-01-01
refused 64 "'2027-02-30' is no time" add net late --role station --until 2027-02-30
refused 64 "is after the authority's own end" add net late --role station --until 2060-01-01
refused 64 'rt/a</topic>' add net late --role vio --topic 'rt/a</topic>'
refused 64 --namespace add net late --role vio --namespace '<*>'
refused 64 --role add net late --role admiral
refused 66 nowhere/authority/key.pem add nowhere late --role station
find net -type f -exec sha256sum {} + | sort | cmp - before || die "what was refused changed a file"
"$backwash" keys add net pilot --role station --force >/dev/null
openssl verify -CAfile net/authority/cert.pem net/pilot/cert.pem >/dev/null || die "the new certificate of pilot"
[[ $(find net -newer before -name key.pem) == net/pilot/key.pem ]] || die "another key than pilot's was replaced"

# Revoked: in every folder's list, for openssl too, and a second time beside the first.
"$backwash" keys revoke net pilot >/dev/null
"$backwash" keys revoke net guest >/dev/null
for list in net/crl.pem net/drone/crl.pem; do
  for who in pilot guest; do
    ! openssl verify -CAfile net/authority/cert.pem -CRLfile $list -crl_check net/$who/cert.pem >verify 2>&1 || die "$who counts by $list"
    grep -q 'certificate revoked' verify || die "$(<verify)"
  done
  openssl verify -CAfile net/authority/cert.pem -CRLfile $list -crl_check net/drone/cert.pem >/dev/null || die "drone was revoked too"
done
"$backwash" keys list net >listed
grep -Eq '^pilot +station +until 20.* revoked$' listed && grep -Eq '^drone +vehicle +until 20[0-9TZ:-]*$' listed && [[ $(wc -l <listed) == 4 ]] || die "list: $(<listed)"
"$backwash" keys list net --json >listed.json
python3 - listed listed.json <<'EOF' || die "list --json says something else than list"
import json, sys
said = [tuple(line.split()) for line in open(sys.argv[1])]
holders = json.load(open(sys.argv[2]))["holders"]
state = lambda h: ("revoked",) * h["revoked"] or ("expired",) * h["expired"]
sys.exit(said != [(h["name"], h["role"], "until", h["ends"]) + state(h) for h in holders])
EOF
"$backwash" keys init signed --protect sign >/dev/null
grep -q '<rtps_protection_kind>SIGN_WITH_ORIGIN_AUTHENTICATION<' signed/governance.p7s && grep -q '<rtps_protection_kind>ENCRYPT_WITH_ORIGIN_AUTHENTICATION<' net/governance.p7s || die "--protect was not kept"
echo "four holders, two of them revoked; openssl agrees with every one"
